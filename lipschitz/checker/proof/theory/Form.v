(** Quadratic forms of upper rows over the reals. *)
From Coq Require Import List Reals Lra Lia Psatz.
From Swarmcert Require Import Algebra.
Import ListNotations.
Open Scope R_scope.

Notation dotR := (dot 0 Rplus Rmult).
Notation applyR := (apply 0 Rplus Rmult).
Notation plusR := (plus Rplus).
Notation scaleR := (scale Rmult).
Notation scale_allR := (scale_all Rmult).
Notation timesR := (times Rmult).
Notation scale_rowsR := (scale_rows Rmult).
Notation columnsR := (columns 0).
Notation sumR := (sum Rplus).
Notation gramR := (gram 0 Rplus Rmult).
Notation bandR := (band 0 Rplus Rmult).

Definition minus (u v : list R) := plusR u (scaleR (-1) v).
Definition square (u : list R) := dotR u u.

(** z' P z. *)
Fixpoint form (p : list (list R)) (z : list R) : R :=
  match p, z with
  | row :: p', a :: z' => a * (hd 0 row * a + 2 * dotR (tl row) z') + form p' z'
  | _, _ => 0
  end.
Definition nonnegative p := forall z, 0 <= form p z.

Lemma dot_nil_r u : dotR u [] = 0. Proof. destruct u; reflexivity. Qed.
Lemma dot_comm u v : dotR u v = dotR v u.
Proof. revert v. induction u as [|a u IH]; intros [|b v]; simpl; auto. rewrite IH. ring. Qed.
Lemma dot_plus_l u v w : dotR (plusR u v) w = dotR u w + dotR v w.
Proof.
  revert v w. induction u as [|a u IH]; intros [|b v] [|c w]; simpl; try ring. rewrite IH. ring.
Qed.
Lemma dot_plus_r u v w : dotR w (plusR u v) = dotR w u + dotR w v.
Proof. rewrite !(dot_comm w). apply dot_plus_l. Qed.
Lemma dot_scale_l a u v : dotR (scaleR a u) v = a * dotR u v.
Proof. revert v. induction u as [|b u IH]; intros [|c v]; simpl; try ring. rewrite IH. ring. Qed.
Lemma dot_scale_r a u v : dotR v (scaleR a u) = a * dotR v u.
Proof. rewrite !(dot_comm v). apply dot_scale_l. Qed.
Lemma dot_times t u v : dotR (timesR t u) v = dotR u (timesR t v).
Proof. revert u v. induction t as [|a t IH]; intros [|b u] [|c v]; simpl; auto. rewrite IH. ring. Qed.
Lemma dot_app u v u' v' : length u = length u' -> dotR (u ++ v) (u' ++ v') = dotR u u' + dotR v v'.
Proof.
  revert u'. induction u as [|a u IH]; intros [|b u']; simpl; try discriminate; intros; [ring|].
  rewrite IH by lia. ring.
Qed.
Lemma dot_app_short u v w : (length u <= length v)%nat -> dotR u (v ++ w) = dotR u v.
Proof. revert v. induction u as [|a u IH]; intros [|b v]; simpl; intros; auto; [lia|]. rewrite IH by lia. ring. Qed.
Lemma dot_zeros n v : dotR (repeat 0 n) v = 0.
Proof. revert v. induction n as [|n IH]; intros [|b v]; simpl; auto. rewrite IH. ring. Qed.
Lemma square_nonneg u : 0 <= square u.
Proof. unfold square. induction u as [|a u IH]; simpl; nra. Qed.
Lemma plus_nil_r (u : list R) : plusR u [] = u. Proof. destruct u; reflexivity. Qed.

Lemma apply_minus m u v : applyR m (minus u v) = minus (applyR m u) (applyR m v).
Proof.
  induction m as [|r m IH]; simpl; auto. unfold minus in *. simpl. now rewrite <- IH, dot_plus_r, dot_scale_r.
Qed.
Lemma apply_scale_rows t m v : applyR (scale_rowsR t m) v = timesR t (applyR m v).
Proof. revert m. induction t as [|a t IH]; intros [|r m]; simpl; auto. now rewrite IH, dot_scale_l. Qed.
Lemma apply_scale_all a m v : applyR (scale_allR a m) v = scaleR a (applyR m v).
Proof. induction m as [|r m IH]; simpl; auto. now rewrite IH, dot_scale_l. Qed.

(** u' (m z) = z' (m' u). *)
Lemma dot_columns m u z : dotR z (applyR (columnsR (length z) m) u) = dotR u (applyR m z).
Proof.
  revert m. induction z as [|a z IH]; intros m; simpl.
  - revert u. induction m as [|r m IH]; intros [|b u]; simpl; auto. rewrite <- IH, dot_nil_r. ring.
  - rewrite IH. clear IH. revert u. induction m as [|r m IH]; intros [|b u]; simpl; try ring.
    assert (dotR r (a :: z) = hd 0 r * a + dotR (tl r) z) as -> by (destruct r; simpl; ring).
    specialize (IH u). nra.
Qed.

(** Sum of z_i row_i. *)
Fixpoint combine_rows (z : list R) (m : list (list R)) : list R :=
  match z, m with a :: z', r :: m' => plusR (scaleR a r) (combine_rows z' m') | _, _ => [] end.
Lemma dot_combine z m w : dotR (combine_rows z m) w = dotR z (applyR m w).
Proof. revert m. induction z as [|a z IH]; intros [|r m]; simpl; auto. now rewrite dot_plus_l, dot_scale_l, IH. Qed.

Lemma form_nil_r p : form p [] = 0. Proof. destruct p; reflexivity. Qed.
Lemma form_sum a b z : form (sumR a b) z = form a z + form b z.
Proof.
  revert b z. induction a as [|r a IH]; intros [|s b] [|c z]; simpl; try ring.
  rewrite IH. replace (hd 0 (plusR r s)) with (hd 0 r + hd 0 s) by (destruct r, s; simpl; ring).
  replace (tl (plusR r s)) with (plusR (tl r) (tl s)); [rewrite dot_plus_l; ring|].
  destruct r, s; simpl; auto. now rewrite plus_nil_r.
Qed.
Lemma form_scale a p z : form (scale_allR a p) z = a * form p z.
Proof.
  revert z. induction p as [|r p IH]; intros [|c z]; simpl; try ring. rewrite IH.
  replace (tl (scaleR a r)) with (scaleR a (tl r)) by (destruct r; reflexivity).
  rewrite dot_scale_l. destruct r; simpl; ring.
Qed.
Lemma form_gram m z : form (gramR m) z = square (combine_rows z m).
Proof.
  unfold square. revert z. induction m as [|r m IH]; intros [|a z]; simpl; auto.
  rewrite IH, dot_plus_l, !dot_plus_r, !dot_scale_l, !dot_scale_r.
  rewrite (dot_comm r (combine_rows z m)), !dot_combine.
  assert (dotR (map (dotR r) m) z = dotR z (applyR m r)) as ->; [|ring].
  rewrite dot_comm. f_equal. unfold apply. apply map_ext. intros. apply dot_comm.
Qed.
(** z' m' m z. *)
Lemma form_gram_columns m z : form (gramR (columnsR (length z) m)) z = square (applyR m z).
Proof.
  rewrite form_gram. set (l := combine_rows z _). unfold square.
  assert (forall w, dotR l w = dotR w (applyR m z)) as H by (intros; unfold l; now rewrite dot_combine, dot_columns).
  now rewrite H, H.
Qed.
Lemma form_block t right rest z z' : length t = length z -> length right = length z ->
  form (diagonal_block 0 t right ++ rest) (z ++ z') =
  dotR z (timesR t z) + 2 * dotR z (applyR right z') + form rest z'.
Proof.
  revert right z. induction t as [|a t IH]; intros [|r right] [|c z]; simpl; try discriminate; intros; try ring.
  rewrite IH, dot_app, dot_zeros by (rewrite ?repeat_length; lia). ring.
Qed.
Lemma form_diagonal t z : length t = length z -> form (diagonal 0 t) z = dotR z (timesR t z).
Proof.
  intros H. rewrite <- (app_nil_r (diagonal 0 t)), <- (app_nil_r z) at 1. unfold diagonal.
  rewrite form_block by (rewrite ?map_length; auto). rewrite form_nil_r.
  assert (forall (s : list R) w, dotR w (applyR (map (fun _ => []) s) []) = 0) as ->; [|ring].
  induction s as [|b s IH]; intros [|c w]; simpl; auto. rewrite IH. ring.
Qed.
