(** PI to 205 bits, from the signs of cos on both sides of PI / 2. *)
From Coq Require Import Reals Lra Lia ZArith Bool.
From Swarmcert Require Import Exponential ErrorFunction.
Open Scope R_scope.

(** Sums of the series of cos at the root of a / b, times b^n (2 n)!, with (- a)^n. *)
Fixpoint cosine_sum (a b : Z) (n : nat) : Z * Z :=
  match n with
  | O => (1, 1)
  | S m =>
      let (s, p) := cosine_sum a b m in
      let q := - (a * p) in (b * (Z.of_nat (2 * m + 1) * Z.of_nat (2 * m + 2)) * s + q, q)
  end%Z.
Lemma cosine_sum_holds x a b n : (0 < b)%Z -> x * x * IZR b = IZR a ->
  cos_approx x n * (IZR b ^ n * INR (fact (2 * n))) = IZR (fst (cosine_sum a b n)) /\
  (- IZR a) ^ n = IZR (snd (cosine_sum a b n)).
Proof.
  intros B X. apply (IZR_lt 0) in B. unfold cos_approx. induction n as [|n [IH P]].
  - unfold cos_term. simpl. split; field.
  - cbn [cosine_sum]. destruct (cosine_sum a b n) as [s p]. cbn [fst snd] in *.
    rewrite tech5, plus_IZR, opp_IZR, !mult_IZR, <- !INR_IZR_INZ, <- IH, <- P. split; [|simpl; ring].
    unfold cos_term. replace (2 * S n)%nat with (S (S (2 * n))) by lia. rewrite !fact_simpl, !mult_INR.
    replace (2 * n + 1)%nat with (S (2 * n)) by lia. replace (2 * n + 2)%nat with (S (S (2 * n))) by lia.
    pose proof (INR_fact_neq_0 (2 * n)). pose proof (not_0_INR (S (2 * n)) ltac:(lia)).
    pose proof (not_0_INR (S (S (2 * n))) ltac:(lia)). set (t := sum_f_R0 _ n).
    set (f := INR (fact (2 * n))) in *. set (u := INR (S (2 * n))) in *. set (v := INR (S (S (2 * n)))) in *.
    assert ((-1) ^ S n * x ^ S (S (2 * n)) * IZR b ^ S n = - (IZR a * (- IZR a) ^ n)) as <-.
    { replace (S (S (2 * n))) with (2 * S n)%nat by lia. rewrite pow_mult, <- !Rpow_mult_distr.
      replace (-1 * x ^ 2 * IZR b) with (- IZR a) by (rewrite <- X; ring). simpl. ring. }
    set (w := x ^ _). simpl (IZR b ^ S n). set (g := (-1) ^ S n). set (c := IZR b ^ n). field. auto.
Qed.
Lemma sum_scale_positive b n : (0 < b)%Z -> 0 < IZR b ^ n * INR (fact (2 * n)).
Proof. intros B. apply (IZR_lt 0) in B. apply Rmult_lt_0_compat; [now apply pow_lt|apply INR_fact_lt_0]. Qed.
Lemma half_pi_above x a b n : (0 < b)%Z -> x * x * IZR b = IZR a -> 0 <= x <= 2 ->
  (0 <? fst (cosine_sum a b (2 * n + 1)))%Z = true -> 2 * x <= PI.
Proof.
  intros B X L H. destruct (cosine_sum_holds x a b (2 * n + 1) B X) as [E _].
  pose proof (sum_scale_positive b (2 * n + 1) B) as S.
  apply Z.ltb_lt, (IZR_lt 0) in H. rewrite <- E in H. destruct (pre_cos_bound x n ltac:(lra) ltac:(lra)) as [C _].
  destruct (Rle_lt_dec (2 * x) PI) as [|G]; auto. pose proof pi_large.
  assert (cos x <= 0) by (apply cos_le_0; lra). set (k := _ * INR _) in *. set (c := cos_approx _ _) in *. nra.
Qed.
Lemma half_pi_below x a b n : (0 < b)%Z -> x * x * IZR b = IZR a -> 0 <= x <= 2 ->
  (fst (cosine_sum a b (2 * (n + 1))) <=? 0)%Z = true -> PI <= 2 * x.
Proof.
  intros B X L H. destruct (cosine_sum_holds x a b (2 * (n + 1)) B X) as [E _].
  pose proof (sum_scale_positive b (2 * (n + 1)) B) as S.
  apply Z.leb_le, IZR_le in H. rewrite <- E in H. destruct (pre_cos_bound x n ltac:(lra) ltac:(lra)) as [_ C].
  destruct (Rle_lt_dec PI (2 * x)) as [|G]; auto.
  pose proof (cos_gt_0 x ltac:(lra) ltac:(lra)). set (k := _ * INR _) in *. set (c := cos_approx _ _) in *. nra.
Qed.

(** In units of 2^-208; b = 2^418. *)
Definition pi_low : Z := 1292376257182206431225192996158063830070948715901097720713054252.
Definition pi_high : Z := 1292376257182206431225192996158063830070948715901097720713054257.
Definition cosine_scale : Z := Z.shiftl 1 418.
Lemma low_sum : (0 <? fst (cosine_sum (pi_low * pi_low) cosine_scale (2 * 13 + 1)))%Z = true.
Proof. vm_compute. reflexivity. Qed.
Lemma high_sum : (fst (cosine_sum (pi_high * pi_high) cosine_scale (2 * (13 + 1))) <=? 0)%Z = true.
Proof. vm_compute. reflexivity. Qed.
Theorem pi_between : IZR pi_low <= PI * IZR (Z.shiftl 1 208) <= IZR pi_high.
Proof.
  set (h := Z.shiftl 1 209). assert (IZR h = 2 * IZR (Z.shiftl 1 208)) as H
    by (rewrite <- mult_IZR; f_equal; vm_compute; reflexivity).
  assert (IZR cosine_scale = IZR h * IZR h) as S by (rewrite <- mult_IZR; f_equal; vm_compute; reflexivity).
  assert (0 < IZR (Z.shiftl 1 208)) as P by (apply (IZR_lt 0); vm_compute; reflexivity).
  assert (forall a, (0 <=? a)%Z && (a <=? 2 * h)%Z = true -> let x := IZR a / IZR h in
    x * x * IZR cosine_scale = IZR (a * a) /\ 0 <= x <= 2 /\ 2 * x * IZR (Z.shiftl 1 208) = IZR a) as X.
  { intros a A x. apply andb_prop in A. destruct A as [A1 A2]. apply Z.leb_le, IZR_le in A1, A2.
    rewrite mult_IZR, H in A2. unfold x. rewrite S, H, (mult_IZR a a). clear - P A1 A2.
    set (d := IZR (Z.shiftl 1 208)) in *. clearbody d.
    assert (IZR a / (2 * d) * (2 * d) = IZR a) as E by (field; lra). set (q := IZR a / (2 * d)) in *. rewrite <- E.
    split; [ring|]. split; [|ring]. split; apply (Rmult_le_reg_r (2 * d)); lra. }
  destruct (X pi_low ltac:(vm_compute; reflexivity)) as (L1 & L2 & L3).
  destruct (X pi_high ltac:(vm_compute; reflexivity)) as (H1 & H2 & H3). cbv zeta in *.
  pose proof (half_pi_above _ _ cosine_scale 13 eq_refl L1 L2 low_sum) as L.
  pose proof (half_pi_below _ _ cosine_scale 13 eq_refl H1 H2 high_sum) as G.
  set (d := IZR (Z.shiftl 1 208)) in *. clearbody d. rewrite <- L3, <- H3. split; apply Rmult_le_compat_r; lra.
Qed.
