(** Chains one after the other, as phi and rho of a deep set are, merged into one. *)
From Coq Require Import List ZArith Reals Lra Lia Bool.
From Swarmcert Require Import Algebra Form Network Checker.
Import ListNotations.

Notation productD := (product zero add mul).
(** The last stage of phi and the first of rho, which no ReLU separates, are one. *)
Definition set_stages (phi : list matrixD) (w : matrixD) (rho : list matrixD) (last : matrixD) : list matrixD *
    matrixD :=
  match rho with [] => (phi, productD last w) | v :: rho' => (phi ++ productD v w :: rho', last) end.
Definition outputs (hidden : list matrixD) (n : nat) : nat := length (List.last hidden (repeat [] n)).
Definition stack := (list matrixD * matrixD)%type.
(** One function after the other: `p`, then each of `ps`, nothing but an added vector between them. *)
Fixpoint check_parts (p : stack) (ps : list stack) (upper r : dyadic) (t : list dyadic) (f : factor) : bool :=
  match ps with
  | [] => check (fst p) (snd p) upper r t f
  | q :: ps' =>
      let joined := set_stages (fst p) (snd p) (fst q) (snd q) in
      let n := inputs (fst p) (snd p) in
      (length (hd [] (snd p)) =? outputs (fst p) n)%nat && (inputs (fst joined) (snd joined) =? n)%nat
      && shapes n (fst p) (snd p) && shapes (length (snd p)) (fst q) (snd q) && check_parts joined ps' upper r t f
  end.

Open Scope R_scope.
Lemma plus_comm u v : plusR u v = plusR v u.
Proof. revert v. induction u as [|a u IH]; intros [|b v]; simpl; auto. now rewrite IH, Rplus_comm. Qed.
Lemma plus_assoc u v w : plusR (plusR u v) w = plusR u (plusR v w).
Proof. revert v w. induction u as [|a u IH]; intros [|b v] [|c w]; simpl; auto. now rewrite IH, Rplus_assoc. Qed.
Lemma apply_plus m u v : applyR m (plusR u v) = plusR (applyR m u) (applyR m v).
Proof. induction m as [|r m IH]; simpl; auto. now rewrite IH, dot_plus_r. Qed.
Lemma apply_product a b v : length (hd [] b) = length v ->
  applyR (product 0 Rplus Rmult a b) v = applyR a (applyR b v).
Proof.
  intros H. unfold product, apply at 1. rewrite map_map. apply map_ext. intros row.
  rewrite H, dot_comm. apply dot_columns.
Qed.
Lemma affine_join v c w b s y : length (hd [] w) = length y ->
  affine (product 0 Rplus Rmult v w) (plusR (applyR v (plusR b s)) c) y = affine v c (plusR (affine w b y) s).
Proof. intros H. unfold affine. now rewrite apply_product, (plus_assoc _ b s), !(apply_plus v),
    !plus_assoc by auto. Qed.

Lemma length_network hidden x : Forall bias_fits hidden -> forall n, length x = n ->
  length (fold_left (fun h l => map relu (affine (fst l) (snd l) h)) hidden x) =
      length (List.last (map fst hidden) (repeat [] n)).
Proof.
  intros H. revert x. induction H as [|[m b] hidden Hb H IH]; intros x n Hn; simpl.
  - now rewrite repeat_length.
  - unfold bias_fits in Hb. simpl in Hb.
    rewrite (IH _ (length m)) by (now rewrite map_length, length_affine).
    clear. destruct hidden as [|l hidden]; simpl; [now rewrite repeat_length|].
    revert l. induction hidden as [|k hidden IH]; intros l; simpl; auto.
Qed.
Lemma network_app h1 h2 last x :
  network (h1 ++ h2) last x = network h2 last (fold_left (fun h l => map relu (affine (fst l) (snd l) h)) h1 x).
Proof. revert x. induction h1 as [|[m b] h1 IH]; intros x; simpl; auto. Qed.
Lemma network_end h last x :
  network h last x = affine (fst last) (snd last) (fold_left (fun h l => map relu (affine (fst l) (snd l) h)) h x).
Proof. revert x. induction h as [|[m b] h IH]; intros x; simpl; auto. Qed.

(** rho(phi(x) + s) as one chain. *)
Definition joined (phi : list (matrix * list R)) (w : matrix) (b s : list R) (rho : list (matrix * list R))
    (last : matrix * list R) :=
  let join l := (product 0 Rplus Rmult (fst l) w, plusR (applyR (fst l) (plusR b s)) (snd l)) in
  match rho with [] => (phi, join last) | v :: rho' => (phi ++ join v :: rho', last) end.
Lemma network_joined phi w b s rho last x : Forall bias_fits phi ->
  length (hd [] w) = length (List.last (map fst phi) (repeat [] (length x))) ->
  network (fst (joined phi w b s rho last)) (snd (joined phi w b s rho last)) x =
  network rho last (plusR (network phi (w, b) x) s).
Proof.
  intros Hp Hw. rewrite <- (length_network phi x Hp _ eq_refl) in Hw.
  destruct rho as [|[v c] rho]; simpl.
  - rewrite !network_end. now apply affine_join.
  - rewrite network_app, (network_end phi). simpl. now rewrite affine_join.
Qed.

Notation biases_fit := (Forall2 (fun (m : matrixD) (c : list R) => length c = length m)).
(** A stack with biases. *)
Definition real_stack := (list (matrix * list R) * (matrix * list R))%type.
Definition run (l : real_stack) : list R -> list R := network (fst l) (snd l).
Definition instance (p : stack) (l : real_stack) := exists bs c, biases_fit (fst p) bs /\ length c = length (snd p) /\
  l = (List.combine (map realm (fst p)) bs, (realm (snd p), c)).
Definition join (l : real_stack) (s : list R) (k : real_stack) : real_stack := joined (fst l) (fst (snd l))
    (snd (snd l)) s (fst k) (snd k).

Lemma instance_fits p l : instance p l -> Forall bias_fits (fst l) /\ map fst (fst l) = map realm (fst p).
Proof.
  intros (bs & c & H & _ & ->). simpl. induction H; simpl; split; try constructor; try apply IHForall2; auto.
  - unfold bias_fits. simpl. now rewrite map_length.
  - f_equal. apply IHForall2.
Qed.

Lemma instance_join p l q k s : instance p l -> instance q k ->
  instance (set_stages (fst p) (snd p) (fst q) (snd q)) (join l s k).
Proof.
  destruct p as [phi w], q as [rho last]. intros (bp & b & Hp & Hb & ->) (br & c & Hr & Hc & ->). unfold join, instance.
      simpl in *.
  assert (forall (v : matrixD) (c : list R), length c = length v ->
    length (plusR (applyR (realm v) (plusR b s)) c) = length (productD v w)) as L.
  { intros v d Hd. change (plusR _ d) with (affine (realm v) d (plusR b s)).
    rewrite length_affine by (now rewrite map_length). unfold product. now rewrite !map_length. }
  destruct Hr as [|v d rho br Hd Hr]; simpl.
  - exists bp, (plusR (applyR (realm last) (plusR b s)) c). repeat split; auto. unfold joined. simpl.
    now rewrite (f_product zero add mul 0 Rplus Rmult real real_zero real_add real_mul).
  - exists (bp ++ plusR (applyR (realm v) (plusR b s)) d :: br), c. repeat split; auto.
    + apply Forall2_app; auto.
    + unfold joined. simpl. rewrite map_app. simpl.
      rewrite (f_product zero add mul 0 Rplus Rmult real real_zero real_add real_mul).
      f_equal. clear -Hp. generalize (plusR (applyR (realm v) (plusR b s)) d). intros z.
      induction Hp; simpl; [reflexivity|congruence].
Qed.

Lemma run_join p l s k x : instance p l -> length x = inputs (fst p) (snd p) ->
  length (hd [] (snd p)) = outputs (fst p) (inputs (fst p) (snd p)) -> run (join l s k) x = run k (plusR (run l x) s).
Proof.
  intros Hl Hx Hw. destruct (instance_fits _ _ Hl) as [F M]. destruct Hl as (bs & c & _ & _ & ->). unfold run, join.
  rewrite network_joined; auto. rewrite M. simpl. unfold outputs in Hw.
  assert (length (hd [] (realm (snd p))) = length (hd [] (snd p))) as ->
      by (destruct (snd p); simpl; auto using map_length).
  rewrite Hw, <- Hx. generalize (length x). intros n. clear. induction (fst p) as [|m phi IH]; simpl;
      [now rewrite !repeat_length|].
  destruct phi; simpl in *; [now rewrite map_length | exact IH].
Qed.

(** Each of `ks` after a vector has been added to what came before. *)
Fixpoint run_after (ks : list (list R * real_stack)) (y : list R) : list R :=
  match ks with [] => y | (s, k) :: ks' => run_after ks' (run k (plusR y s)) end.

Theorem check_parts_sound ps p upper r t f : check_parts p ps upper r t f = true ->
  forall l ks, instance p l -> Forall2 (fun q k => instance q (snd k)) ps ks ->
  forall x x', length x = inputs (fst p) (snd p) -> length x' = inputs (fst p) (snd p) ->
  norm (minus (run_after ks (run l x)) (run_after ks (run l x'))) <= real upper * norm (minus x x').
Proof.
  revert p. induction ps as [|q ps IH]; intros p H l ks Hl Hks x x' Hx Hx'; inversion Hks as [|? [s k] ? ks' Hk Hks'];
      subst; simpl in *.
  - destruct Hl as (bs & c & Hbs & Hc & ->). exact (check_sound _ _ _ _ _ _ H bs c Hbs Hc x x' Hx Hx').
  - do 3 (apply andb_prop in H; destruct H as [H ?HC]). apply andb_prop in H. destruct H as [HW HI]. apply Nat.eqb_eq in
      HW, HI.
    rewrite <- !(run_join p l s k) by auto.
    eapply IH; eauto using instance_join; congruence.
Qed.
